"""`check` tells of models that fly other numbers in another process, and of those that end the process."""

import pytest
from falling import MODEL, engine, falling

SAME = "differs between two processes; a case must depend on its inputs and case_id alone"


def checked(folder, *words):
    return engine("check", folder, *words, cwd=folder, PYTHONHASHSEED="7")


@pytest.mark.parametrize(
    ("factor", "sentence"),
    [
        ("hash('gravity') % 1000 / 1000.0", f"`FACTOR` in model.py {SAME}"),
        pytest.param("__import__('time').time()", f"`FACTOR` in model.py {SAME}", marks=pytest.mark.slow),
        ("float(__import__('os').environ.get('FACTOR', 1.0))", 'model.py, line 4 reads the environment variable "FACT'),
    ],
)
def test_a_constant_that_another_process_has_otherwise_is_named(factor, sentence, tmp_path):
    done = checked(falling(tmp_path, MODEL.replace("FACTOR = 1.0", f"FACTOR = {factor}")))
    assert done.returncode == 2
    assert sentence in done.stderr


def test_what_prepare_gives_otherwise_in_another_process_is_named(tmp_path):
    random = "    return {'gravity': inputs.gravity + DRAW}"
    model = MODEL.replace("    return vars(inputs)", random).replace("FACTOR =", "DRAW = np.random.random()\nFACTOR =")
    done = checked(falling(tmp_path, "import numpy as np\n" + model))
    assert done.returncode == 2
    assert f'"gravity" of the nominal case, from `prepare`, {SAME}' in done.stderr


def test_a_model_that_is_the_same_everywhere_passes(tmp_path):
    setting = "import os\nos.environ.setdefault('OMP_NUM_THREADS', '1')\n"
    assert checked(falling(tmp_path, setting + MODEL)).returncode == 0


@pytest.mark.parametrize("words", [["run", "--no-report", "--out", "flown"], ["check"]])
@pytest.mark.parametrize("place", ["import", "prepare"])
def test_a_model_that_leaves_by_the_back_door_is_told(words, place, tmp_path):
    way_out = "__import__('os')._exit(0)"
    texts = {
        "import": MODEL.replace("FACTOR = 1.0", f"FACTOR = 1.0\n{way_out}"),
        "prepare": MODEL.replace("    refusals.add(", f"    {way_out}\n    refusals.add("),
    }
    done = engine(words[0], tmp_path / "mine", *words[1:], cwd=falling(tmp_path / "mine", texts[place]))
    assert done.returncode == 2
    line = texts[place].splitlines().index(next(one for one in texts[place].splitlines() if "_exit" in one)) + 1
    assert f"model.py, line {line}: os._exit(0) ends the program" in done.stderr
