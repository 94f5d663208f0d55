"""Design of burn programs, once for all cases: the free-time optimum and the source's staged procedure.

`program.program_for(sequence)` is the entry.  The optimum goes `continuation` -> `optimal`; the source's procedure is
`staged`.  Both integrate by `powered_arc` and `coast`; `program` turns either into data for a flight.
"""
