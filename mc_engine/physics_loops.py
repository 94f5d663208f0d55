"""How often the loops of physics go round, as far as their source tells."""

import ast

from mc_engine.physics_scope import Scope

MOST_TIMES = 1_000_000  # of a loop, in one step


def times(node: ast.Call, scope: Scope) -> int:
    """How often a loop over range(...) goes round, 0 where that is not known."""
    if scope.value(node.func) is not range or node.keywords:
        return 0
    bounds = [_whole(one, scope) for one in node.args]
    known = [one for one in bounds if one is not None]
    if len(known) < len(bounds) or not 1 <= len(known) <= 3 or known[2:] == [0]:
        return 0
    ends = range(*known)
    return max(0, (ends.stop - ends.start) // ends.step)


def _whole(node: ast.AST, scope: Scope) -> int | None:
    """The whole number that is written, or named, or a power or product of such; None for anything else."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow | ast.Mult):
        left, right = _whole(node.left, scope), _whole(node.right, scope)
        if left is None or right is None:
            return None
        if isinstance(node.op, ast.Mult):
            return left * right
        return left**right if 0 <= right <= 64 and abs(left) <= MOST_TIMES else None
    value = node.value if isinstance(node, ast.Constant) else scope.value(node)
    return value if isinstance(value, int) else None


_MIRRORED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE}


def counts(loop: ast.While, scope: Scope) -> bool:
    """Whether a loop goes on until a counter, which it only steps, passes a bound that it leaves alone."""
    test = loop.test
    if not (isinstance(test, ast.Compare) and len(test.ops) == 1 and type(test.ops[0]) in _MIRRORED):
        return False
    relation, one, other = type(test.ops[0]), test.left, test.comparators[0]
    return _counts(loop, one, relation, other, scope) or _counts(loop, other, _MIRRORED[relation], one, scope)


def _counts(loop: ast.While, counter: ast.expr, relation: type[ast.cmpop], end: ast.expr, scope: Scope) -> bool:
    """The same, of a loop that goes on while `counter` has the relation to `end`."""
    if not isinstance(counter, ast.Name):
        return False
    most = end.value if isinstance(end, ast.Constant) else _whole(end, scope)
    if isinstance(most, int | float) and abs(most) > MOST_TIMES:
        return False
    nodes = [node for line in loop.body for node in ast.walk(line)]
    written = [node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    bound = {node.id for node in ast.walk(end) if isinstance(node, ast.Name)}
    step = ast.Add if relation in (ast.Lt, ast.LtE) else ast.Sub
    steps = [line for line in loop.body if _is_a_step(line, counter.id, step, scope)]
    skipped = any(isinstance(node, ast.Continue) for node in nodes)
    return bool(steps) and written.count(counter.id) == 1 and not bound & set(written) and not skipped


def _is_a_step(line: ast.stmt, counter: str, step: type[ast.operator], scope: Scope) -> bool:
    """Whether a line is `counter += size` or `counter = counter + size`, with a size above zero."""
    target: ast.expr
    if isinstance(line, ast.AugAssign):
        target, operator, size = line.target, line.op, line.value
    elif isinstance(line, ast.Assign) and isinstance(line.value, ast.BinOp) and len(line.targets) == 1:
        target, operator, size = line.targets[0], line.value.op, line.value.right
        if not (isinstance(line.value.left, ast.Name) and line.value.left.id == counter):
            return False
    else:
        return False
    value = size.value if isinstance(size, ast.Constant) else _whole(size, scope)
    stepped = isinstance(target, ast.Name) and target.id == counter and isinstance(operator, step)
    return stepped and isinstance(value, int | float) and value > 0
