"""The campaign of a run directory, as it was flown: what resumes, replays and workers begin with."""

import os
from pathlib import Path

from mc_engine.campaign import Campaign, load_campaign
from mc_engine.designs import EXTENSIBLE
from mc_engine.errors import CampaignError, Problem, StoreError
from mc_engine.files_read import data_read
from mc_engine.kernel import source_digest
from mc_engine.manifest import sampling_digest
from mc_engine.model_sources import sources_beside
from mc_engine.store import Store
from mc_engine.streams import SEED_CONTRACT
from mc_engine.upstream import COMPANION

_OWN = ("cases", "history")  # folders of a run directory


def campaign_of(store: Store, directory: Path | None = None) -> Campaign:
    """The campaign as it was flown, at its present length; StoreError if model or campaign have changed since.

    directory : where its files lie, if not in the run directory.
    """
    store.check_companions()
    recorded = store.manifest["campaign"]
    known = {*store.manifest, *store.manifest.get("model", {}), *recorded}
    if not {"seed_contract", "digest", "sampling_digest", "design", "seed"} <= known:
        raise StoreError(f"{store.path}: its manifest does not say how the campaign was flown; run the campaign anew")
    cases = store.n_cases if recorded["design"] in ("lhs", *EXTENSIBLE) else None
    campaign = load_campaign(
        recorded["name"],
        cases=cases,
        seed=recorded["seed"],
        text=store.campaign_text,
        directory=directory or store.path,
        upstream=store.path / COMPANION if store.manifest.get("upstream") is not None else None,
    )
    if campaign.digest != recorded["digest"]:
        raise StoreError(f"{store.path}: a file of the campaign was edited; run the campaign anew")
    ours = source_digest(campaign.model, campaign.directory), sampling_digest(), SEED_CONTRACT
    model, contract = store.manifest["model"], store.manifest["seed_contract"]
    if ours != (model["digest"], model["sampling_digest"], contract):
        raise StoreError(f"{store.path}: was flown by other sources of engine or model; run the campaign anew")
    return campaign


def companions_of(campaign: Campaign) -> dict[str, bytes]:
    """Files that the campaign reads from its own folder, by their names there: a run directory stands alone."""
    files = {one.spec["file"] for one in campaign.dispersions if one.dist == "empirical"} | set(campaign.messages)
    base = campaign.directory.resolve()
    paths = {base / file for file in files}
    if campaign.table_path is not None:
        paths.add(campaign.table_path)
    if campaign.model_reference.endswith(".py"):
        model = Path(os.path.normpath(base / campaign.model_reference))
        paths.update([*sources_beside(model), *data_read(model.parent)])
    contents = {_name_in(base, path): path.read_bytes() for path in sorted(paths)}
    for name in contents:
        if name.split("/")[0] in _OWN:
            sentence = (
                f'{name}: every run has a folder "{name.split("/")[0]}" of its own; give the model\'s another name'
            )
            raise CampaignError(campaign.name, [Problem("campaign.model", sentence)])
    return contents if campaign.upstream is None else {**contents, COMPANION: campaign.upstream.rows.content}


def _name_in(folder: Path, path: Path) -> str:
    """The name that a file has in a folder; of a link the link's, by which it is called."""
    plain = Path(os.path.normpath(path))
    return (plain if plain.is_relative_to(folder) else path.resolve()).relative_to(folder).as_posix()
