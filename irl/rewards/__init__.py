"""Rewards as functions of a batch: hand-written, learned, frozen."""
