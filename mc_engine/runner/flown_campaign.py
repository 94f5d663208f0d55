"""The campaign of a run directory, as it was flown: what resumes, replays and workers begin with."""

import os
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.campaign.sensitivity_design import companion
from mc_engine.campaign.upstream import COMPANION
from mc_engine.durable_file import make_way, write_inside
from mc_engine.errors import CampaignError, EngineError, ModelError, Problem, StoreError
from mc_engine.flight.kernel import source_digest
from mc_engine.flight.nominal_inputs import nominal_inputs
from mc_engine.model.record import load_model, sources_of
from mc_engine.runner.manifest import columns_of, sampling_digest
from mc_engine.sampling.designs import EXTENSIBLE
from mc_engine.sampling.streams import SEED_CONTRACT
from mc_engine.store.derived_files import FIGURES, REPLAYS
from mc_engine.store.parts import CASE_COLUMNS, PART_FOLDERS
from mc_engine.store.run_files import SENSITIVITY
from mc_engine.store.run_folder import readable
from mc_engine.store.store import Store

_OWN = (*PART_FOLDERS, SENSITIVITY, FIGURES, REPLAYS)  # folders of a run directory


def campaign_of(store: Store, directory: Path | None = None) -> Campaign:
    """The campaign as it was flown, at its present length; StoreError if model or campaign have changed since.

    directory : where its files lie, if not in the run directory.
    """
    store.check_companions()
    recorded = store.manifest["campaign"]
    model, contract = store.manifest.get("model", {}), store.manifest.get("seed_contract")
    flown_by = model.get("digest"), model.get("sampling_digest"), contract
    if None in (*flown_by, recorded.get("digest"), recorded.get("design"), recorded.get("seed")):
        raise StoreError(f"{store.path}: its manifest does not say how the campaign was flown; run the campaign anew")
    beside = store.manifest.get("sensitivity")
    drawn = beside if beside is not None else {"design": recorded["design"], "cases": store.n_cases}
    cases = drawn["cases"] if drawn["design"] in ("lhs", *EXTENSIBLE) else None
    campaign = load_campaign(
        recorded["name"],
        cases=cases,
        seed=recorded["seed"],
        text=store.campaign_text,
        directory=directory or store.path,
        upstream=store.path / COMPANION,  # also where the manifest has none: a run leads nowhere else
    )
    if beside is not None and campaign.sensitivity is not None:
        campaign = companion(campaign)
    if campaign.digest != recorded["digest"]:
        raise StoreError(f"{store.path}: a file of the campaign was edited; run the campaign anew")
    ours = source_digest(campaign.model, campaign.directory), sampling_digest(), SEED_CONTRACT
    if ours != flown_by or (*CASE_COLUMNS, *columns_of(campaign)) != store.columns:
        raise StoreError(f"{store.path}: was flown by other sources of engine or model; run the campaign anew")
    return campaign


def companions_of(campaign: Campaign) -> dict[str, bytes]:
    """Files that the campaign reads from its own folder, by their names there: a run directory stands alone."""
    files = {one.spec["file"] for one in campaign.dispersions if one.dist == "empirical"} | set(campaign.messages)
    base = campaign.directory.resolve()
    paths = {base / file for file in files}
    if campaign.table_path is not None:
        paths.add(campaign.table_path)
    contents = {**{_name_in(base, path): path.read_bytes() for path in paths}, **_files_of_model(campaign)}
    for name in sorted(contents):
        if name != readable(name):
            sentence = f"reads {name!a}, whose name is no text in UTF-8; give it another"
            raise CampaignError(campaign.name, [Problem("campaign.model", sentence)])
        if name.split("/")[0] in _OWN:
            sentence = (
                f'{name}: every run has a folder "{name.split("/")[0]}" of its own; give the model\'s another name'
            )
            raise CampaignError(campaign.name, [Problem("campaign.model", sentence)])
    return contents if campaign.upstream is None else {**contents, COMPANION: campaign.upstream.rows.content}


def _files_of_model(campaign: Campaign) -> dict[str, bytes]:
    """Sources and data of a model that is a file, as they were read; nothing of an installed one."""
    if not campaign.model_reference.endswith(".py"):
        return {}
    sources, base = sources_of(campaign.model), campaign.directory.resolve()
    return {_name_in(base, path): content for path, content in sorted({**sources.files, **sources.data}.items())}


def refuse_undeclared_data(campaign: Campaign) -> None:
    """ModelError if the model, which is sound, cannot begin from the copies of its files that a run keeps.

    A file that it opens by a path outside its own folder is not found out.
    """
    if not (files := _files_of_model(campaign)):
        return
    with TemporaryDirectory(prefix="mc-engine-") as name:
        folder = Path(name).resolve()
        for file, content in files.items():
            make_way(folder, file)
            write_inside(folder, file, content)
        try:
            nominal_inputs(replace(campaign, model=load_model(campaign.model_reference, folder)))
        except EngineError as error:
            why = str(error).replace(f"{folder}{os.sep}", "")
            kept = "a run keeps copies of the model's sources and of the files in Model(data=...), and of no others"
            raise ModelError(f"{why}; {kept}") from None


def _name_in(folder: Path, path: Path) -> str:
    """The name that a file has in a folder; of a link the link's, by which it is called."""
    plain = Path(os.path.normpath(path))
    return (plain if plain.is_relative_to(folder) else path.resolve()).relative_to(folder).as_posix()
