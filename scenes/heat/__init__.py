"""The heat of rooms in detail: studies with shading states, control, set points and lighting."""
