"""Measurements as typed blocks: headline, cards, tables, charts, notes, and the protocol of a kind."""
