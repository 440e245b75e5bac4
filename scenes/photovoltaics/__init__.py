"""Photovoltaics on a building: modules found in the IFC, irradiance of each cell, yield."""
