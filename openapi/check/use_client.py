"""Uses the generated Python client once against a filled server: python use_client.py URL KEY."""

import sys

from locution_api import AuthenticatedClient
from locution_api.api.maps import get_grid_pgm, list_matches
from locution_api.api.runs import list_scans
from locution_api.api.sites import get_site, make_site
from locution_api.api.texts import query_words
from locution_api.models import MatchPage, NewSite, Problem, Site, SiteSummary, StoredScanPage, WordPattern, WordQuery
from locution_api.types import File


def main(url: str, key: str) -> None:
    client = AuthenticatedClient(base_url=url, token=key)
    site = get_site.sync("office", client=client)
    assert isinstance(site, Site) and site.num_scans > 0, site

    scans = list_scans.sync("office", "drive", client=client, limit=5)
    assert isinstance(scans, StoredScanPage) and len(scans.items) == 5, scans

    matches = list_matches.sync("office", client=client, limit=3)
    assert isinstance(matches, MatchPage), matches

    query = WordQuery(words=[WordPattern(class_=4)], limit=3)
    answers = query_words.sync("office", client=client, body=query)
    assert isinstance(answers, list), answers

    grid = get_grid_pgm.sync("office", client=client)
    assert isinstance(grid, File) and grid.payload.read(2) == b"P5", grid

    made = make_site.sync("another", client=client, body=NewSite())
    assert isinstance(made, SiteSummary), made
    missing = get_site.sync("nowhere", client=client)
    assert isinstance(missing, Problem) and missing.status == 404, missing
    print(f"{site.site}: {site.num_scans} scans, {len(matches.items)} matches seen, {len(answers)} places")


if __name__ == "__main__":
    main(*sys.argv[1:])
