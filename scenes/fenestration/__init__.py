"""What fills the windows: systems from files, from the IFC model, from stated values."""
