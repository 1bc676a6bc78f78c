"""Rigid bodies: trees of links, their dynamics, and arms made of them."""
