"""Puts this folder, with the runs that several tests of the reports begin with, on the path of their imports."""
