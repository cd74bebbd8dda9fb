"""Studies: what choices cost and what they gain."""
