"""Render processes and the pool that feeds them: pictures for whoever must not render itself."""
