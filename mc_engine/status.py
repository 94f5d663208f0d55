"""How a case ended: small codes in the kernels, words in the tables.

A failed case is data.  Its row keeps the inputs, the status and the last state; metrics are NaN.
"""

MOST_CASES = 1_000_000_000  # of a run

OK = 0
NOT_FINITE = 1
STEP_LIMIT = 2
EVENT_LIMIT = 3
NO_STOP = 4
REFUSED = 5
WORKER_DIED = 6
TIME_LIMIT = 7
CRASHED = 8
MEMORY_LIMIT = 9
NO_RESULT = 10

STATUS_NAME = {
    OK: "ok",
    NOT_FINITE: "not-finite",
    STEP_LIMIT: "step-limit",
    EVENT_LIMIT: "event-limit",
    NO_STOP: "no-stop",
    REFUSED: "refused",
    WORKER_DIED: "worker-died",
    TIME_LIMIT: "time-limit",
    CRASHED: "crashed",
    MEMORY_LIMIT: "memory-limit",
    NO_RESULT: "no-result",
}

STATUS_TEXT = {
    OK: "completed",
    NOT_FINITE: "a state, event or simulator's metric is infinite or not a number; the last finite state is kept",
    STEP_LIMIT: "the cap on integration steps was reached",
    EVENT_LIMIT: "more events in one step than the engine follows; the control chatters",
    NO_STOP: "the flight reached its time limit before the event that should end it",
    REFUSED: "the model cannot start from these inputs; the column `reason` says why",
    WORKER_DIED: "the process flying this case died, or had too little memory for it",
    TIME_LIMIT: "the case took longer than it was allowed to; `mc-engine rerun` can give it more",
    CRASHED: "the simulator ended by an exception, a signal or an exit code; the column `reason` says which",
    MEMORY_LIMIT: "the simulator needed more memory than it was allowed to have",
    NO_RESULT: "the simulator's output is missing, unreadable or incomplete; the column `reason` says what is wrong",
}

STATUS_MEANING = {STATUS_NAME[code]: text for code, text in STATUS_TEXT.items()}  # by the word
