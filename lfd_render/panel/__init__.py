"""The panel image: picture files and the virtual panel."""
