"""Examples of automation: they parse, every verb and option in them exists, and the job array flies."""

import os
import re
import shlex
import stat
import subprocess
import sys
from pathlib import Path

import pytest
import typer
import yaml
from typer.testing import CliRunner

import mc_engine
from mc_engine import load_campaign, open_store
from mc_engine.command_line.commands import app
from mc_engine.runner import runner

EXAMPLES = Path(mc_engine.__file__).parent / "documentation" / "examples"
WORKFLOW = EXAMPLES / "campaign.yml"
ARRAYS = {  # what the batch system tells a job
    "job_array.sh": {"SLURM_ARRAY_TASK_ID": "{job}", "SLURM_CPUS_PER_TASK": "1"},
    "job_array_pbs.sh": {"PBS_ARRAY_INDEX": "{job}", "PBS_O_WORKDIR": "."},
    "job_array_lsf.sh": {"LSB_JOBINDEX": "{job}"},
}
VERBS = typer.main.get_command(app).commands


def command_lines():
    """(file, words after `mc-engine`) of every call in the examples, those in comments too."""
    for path in sorted(path for path in EXAMPLES.iterdir() if path.is_file()):
        for call in re.findall(r"mc-engine ([a-z][^`\n;)]*)", path.read_text()):
            yield path.name, call.replace('"', "").split()


@pytest.mark.parametrize(("file", "words"), list(command_lines()))
def test_every_verb_and_option_of_the_examples_exists(file, words):
    verb, *arguments = words
    known = {option for parameter in VERBS[verb].params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in arguments if word.startswith("--")} <= known


def test_the_workflow_fails_on_a_broken_requirement_and_on_a_change():
    (job,) = yaml.safe_load(WORKFLOW.read_text())["jobs"].values()
    calls = [step["run"] for step in job["steps"] if step.get("run", "").startswith("mc-engine")]
    assert [call.split()[1] for call in calls] == ["check", "run", "compare"]
    assert "--judge" in calls[1]
    assert not any("|| true" in call for call in calls)
    assert not any(step.get("continue-on-error") for step in job["steps"])


@pytest.mark.parametrize("name", ARRAYS)
def test_the_shell_reads_the_job_array_without_a_word(name):
    assert subprocess.run(["bash", "-n", EXAMPLES / name], check=False).returncode == 0


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name == "job_array_pbs.sh" else ()) for name in ARRAYS]
)
def test_the_job_array_flies_and_resumes_its_pieces_to_one_run(tmp_path, name):
    script, text = tmp_path / "job_array.sh", (EXAMPLES / name).read_text()
    for line, ours in (("CAMPAIGN=my_case", "small"), ("PIECES=20", "2"), ("WORKERS=16", "1")):
        text = text.replace(line, f"{line.split('=')[0]}={ours}")
    script.write_text(text)
    assert CliRunner().invoke(app, ["init", str(tmp_path / "small")]).exit_code == 0
    file = tmp_path / "small" / "campaign.toml"
    file.write_text(file.read_text().replace("cases = 2000", "cases = 60"))
    for job in ("1", "2", "2"):  # the last one again, as after a kill
        told = {key: value.format(job=job) for key, value in ARRAYS[name].items()}
        environment = {**environment_in(tmp_path), **told}
        done = subprocess.run(["bash", script], cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    merged = runner.merge(tmp_path / "merged", sorted((tmp_path / "shards").iterdir()), workers=1)
    whole = runner.run(load_campaign(tmp_path / "small"), tmp_path / "whole", workers=1)
    assert open_store(merged.path).cases().equals(whole.cases())


def environment_in(folder):
    """The shell's, with an `mc-engine` that is this interpreter's."""
    program = folder / "bin" / "mc-engine"
    if not program.exists():
        program.parent.mkdir()
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m mc_engine "$@"\n')
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
    root = str(Path(mc_engine.__file__).parents[1])
    return {**os.environ, "PYTHONPATH": root, "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}"}
