"""The campaign of a run directory, as it was flown.  Used by resume, extend, replay, merge and worker processes.

`refuse_undeclared_data`, which `check` calls, loads nothing of the store.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.durable_file import make_way, write_inside
from mc_engine.errors import CampaignError, EngineError, ModelError, Problem, StoreError, UsageError
from mc_engine.flight.flyers import flyer_of
from mc_engine.model.record import Model, load_model, sources_of
from mc_engine.model.simulator import Simulator, load_simulator
from mc_engine.store.run_files import SENSITIVITY, SIMULATOR, readable

if TYPE_CHECKING:
    from mc_engine.store.store import Store


def campaign_of(store: "Store", directory: Path | None = None) -> Campaign:
    """The campaign of a run, with its present number of cases.

    directory : folder of the campaign's files, by default the run directory with its copies.
    UsageError if its results were imported; StoreError if the model, the campaign or the engine's sources have changed
    since the run began.
    """
    from mc_engine.campaign.sensitivity_design import companion
    from mc_engine.campaign.upstream import COMPANION
    from mc_engine.runner.manifest import columns_of, engine_version, sampling_digest
    from mc_engine.sampling.designs import EXTENSIBLE
    from mc_engine.sampling.streams import SEED_CONTRACT
    from mc_engine.store.parts import CASE_COLUMNS

    if imported := store.manifest.get("imported"):
        why = f"its results were imported from {imported['file']}; the engine did not fly them"
        raise UsageError(f"{store.path}: {why}")
    store.check_originals()
    recorded = store.manifest["campaign"]
    model, contract = store.manifest.get("model", {}), store.manifest.get("seed_contract")
    flown_by = model.get("digest"), model.get("sampling_digest"), contract
    if None in (*flown_by, recorded.get("digest"), recorded.get("design"), recorded.get("seed")):
        raise StoreError(f"{store.path}: its manifest does not say how the campaign was flown; run the campaign anew")
    other_sources = StoreError(f"{store.path}: {_other_sources(store.manifest.get('engine'), engine_version())}")
    if (sampling_digest(), SEED_CONTRACT) != flown_by[1:]:  # first: an older file or model may no longer be readable
        raise other_sources
    sensitivity = store.manifest.get("sensitivity")
    drawn = sensitivity if sensitivity is not None else {"design": recorded["design"], "cases": store.n_cases}
    cases = drawn["cases"] if drawn["design"] in ("lhs", *EXTENSIBLE) else None
    campaign = load_campaign(
        recorded["name"],
        cases=cases,
        seed=recorded["seed"],
        text=store.campaign_text,
        directory=directory or store.path,
        upstream=store.path / COMPANION,  # also without an upstream run: a run reads no other directory
    )
    if sensitivity is not None and campaign.sensitivity is not None:
        campaign = companion(campaign)
    if campaign.digest != recorded["digest"]:
        raise StoreError(f"{store.path}: a file of the campaign was edited; run the campaign anew")
    if flyer_of(campaign).digest() != flown_by[0] or (*CASE_COLUMNS, *columns_of(campaign)) != store.columns:
        raise other_sources
    return campaign


def _other_sources(flown: str | None, present: str) -> str:
    """Why a run with other sources is refused, and the remedy.  flown, present : versions of the engine."""
    if flown in (None, present):
        return "was flown by other sources of engine or model; run the campaign anew"
    return f"was flown by mc-engine {flown}, and this is {present}; use that version, or run the campaign anew"


def companions_of(campaign: Campaign) -> dict[str, bytes]:
    """Contents by name of the files that the campaign reads from its own folder.  The run directory keeps copies."""
    from mc_engine.campaign.upstream import COMPANION
    from mc_engine.store.derived_files import FIGURES, REPLAYS
    from mc_engine.store.parts import PART_FOLDERS

    folders_of_a_run = (*PART_FOLDERS, SENSITIVITY, FIGURES, REPLAYS, SIMULATOR)
    base = campaign.directory.resolve()
    tables = {_name_in(base, path): _as_loaded(campaign, path) for path in campaign.files}
    contents = {**tables, **_files_of_model(campaign)}
    for name in sorted(contents):
        if name != readable(name):
            sentence = f"reads {name!a}, whose name is no text in UTF-8; give it another"
            raise CampaignError(campaign.name, [Problem("campaign.model", sentence)])
        if name.split("/")[0] in folders_of_a_run:
            sentence = (
                f'{name}: every run has a folder "{name.split("/")[0]}" of its own; give the model\'s another name'
            )
            raise CampaignError(campaign.name, [Problem("campaign.model", sentence)])
    return contents if campaign.upstream is None else {**contents, COMPANION: campaign.upstream.rows.content}


def _as_loaded(campaign: Campaign, path: Path) -> bytes:
    """The content of a file that a campaign has read; CampaignError if it was edited or removed since."""
    content = path.read_bytes() if path.is_file() else b""
    if sha256(content).hexdigest() != campaign.files[path]:
        sentence = f'"{path.name}" was edited or removed after the campaign was loaded; load the campaign again'
        raise CampaignError(campaign.name, [Problem("", sentence)])
    return content


def _files_of_model(campaign: Campaign) -> dict[str, bytes]:
    """Sources and data of a model that is a file, as they were read; empty for an installed model."""
    model = campaign.model
    if not (campaign.model_reference.endswith(".py") or (isinstance(model, Simulator) and model.is_described)):
        return {}
    sources = sources_of(model) if isinstance(model, Model) else model.sources
    assert sources is not None  # a loaded simulator has them
    base = campaign.directory.resolve()
    return {_name_in(base, path): content for path, content in sorted({**sources.files, **sources.data}.items())}


@contextmanager
def copies_of(campaign: Campaign) -> Iterator[Path | None]:
    """A folder, for the block, of the copies that a run keeps of the model's files; None if the model is no file."""
    if not (files := _files_of_model(campaign)):
        yield None
        return
    with TemporaryDirectory(prefix="mc-engine-") as name:
        folder = Path(name).resolve()
        for file, content in files.items():
            make_way(folder, file)
            write_inside(folder, file, content)
        yield folder


def refuse_undeclared_data(campaign: Campaign) -> None:
    """ModelError if the model does not work with the copies of its files that a run keeps.

    The cause is a data file that is not named in `data`.  A file outside the model's folder is not detected.
    """
    with copies_of(campaign) as folder:
        if folder is None:
            return
        try:
            _start_from(campaign, folder)
        except EngineError as error:
            why = str(error).replace(f"{folder}{os.sep}", "")
            kept = "a run keeps copies only of the model's sources and of the files that its `data` names"
            raise ModelError(f"{why}; {kept}") from None


def _start_from(campaign: Campaign, folder: Path) -> None:
    """Load the model or simulator from `folder`; of a model, compute what its nominal case begins with."""
    if isinstance(campaign.model, Simulator):
        if not campaign.model.is_described:
            load_simulator(campaign.model_reference, folder)
        return
    from mc_engine.flight.repeatability import nominal_inputs  # which loads the compiler

    nominal_inputs(replace(campaign, model=load_model(campaign.model_reference, folder)))


def _name_in(folder: Path, path: Path) -> str:
    """The name of a file relative to a folder; for a symbolic link, the name of the link."""
    plain = Path(os.path.normpath(path))
    return (plain if plain.is_relative_to(folder) else path.resolve()).relative_to(folder).as_posix()
