"""Light-field rendering for tilted-lenticular displays: scenes in, panel images out."""

__version__ = "0.1.0"
