"""The documentation as a site: pages written by hand, and reference pages made from the program itself.

`python -m mc_engine.documentation FOLDER` builds it, without a network, into pages that work from a disk.
"""
