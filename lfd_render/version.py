"""The version, for parts that may not import the package's own __init__."""

__version__ = "0.1.0"
