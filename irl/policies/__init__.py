"""Exported policies, their cards, and the shelf of experts."""
