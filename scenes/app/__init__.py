"""The local page of `cfs app`: a project folder, its commands and a server for this machine."""
