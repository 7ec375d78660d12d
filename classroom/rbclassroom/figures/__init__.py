"""Figures that one lesson shows: tables, drawings and descriptions, a module for each lesson."""
