"""Speed against peers: time to the same result on the same machine, as ratios."""
