"""Figures that one lesson shows: tables, drawings and descriptions, by lesson."""
