"""Errors against a reference."""
