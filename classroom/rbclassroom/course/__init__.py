"""Run, store and open the lessons, and list where equations are used."""
