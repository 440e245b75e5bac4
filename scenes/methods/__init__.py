"""The methods for daylight and glare, divided into what a scene, a system and a time step need."""
