"""Weather, sun and skies: from an EPW or WEA file to the luminance of every sky patch."""
