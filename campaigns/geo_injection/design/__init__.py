"""Design of burn programs, once for all cases: the free-time optimum and the source's staged procedure.

`programs.program_for(sequence)` is the entry.  The optimum goes `impulsive` -> `continuation` (`added_burn` for three
burns) -> `optimal`, judged by `optimality`; the source's procedure goes `staged` -> `single_burn`.  Both integrate by
`powered_arc` and `coast`; `program` turns either into data that a flight reads.
"""
