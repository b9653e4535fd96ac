"""The OpenAPI description against the server: schemathesis asks what it allows and what it does not."""

from __future__ import annotations

import shutil

import pytest
from hypothesis import given, settings

import forcemap as fm
from sizes import FULL_SIZE
from web_server import PATIENCE, TOKEN, bearer, client_of

EXAMPLES = 100 if FULL_SIZE else 2
SLOW = {
    "/api/campaigns/{name}/files/report.html": 4,
    "/api/campaigns/{name}/files/report.zip": 4,
    "/api/campaigns/{name}/files/speeds": 3,
}


@pytest.fixture(scope="module")
def description(tmp_path_factory, simulated):
    """The description of a server with a campaign of twenty recordings."""
    import schemathesis

    root = tmp_path_factory.mktemp("served")
    shutil.copytree(simulated, root / "lab")
    (root / "lab" / "recordings.csv").unlink()
    for path in sorted((root / "lab" / "recordings").iterdir())[20:]:
        path.unlink()
    (root / "lab" / "impacts.csv").write_bytes((fm.copy_example("ur10e", root / "ur10e") / "impacts.csv").read_bytes())
    with client_of(root) as client:
        address = f"{str(client.base_url).rstrip('/')}/api/openapi.json"
        yield schemathesis.openapi.from_url(address, headers=bearer(TOKEN))


def test_every_answer_is_as_described(description):
    from schemathesis import GenerationMode

    operations = [found.ok() for found in description.get_all_operations()]
    assert len(operations) == 35
    for operation in operations:
        of_the_campaign = {"path_parameters": {"name": "lab"}} if "{name}" in operation.path else {}
        whole = [(GenerationMode.POSITIVE, {}), (GenerationMode.POSITIVE, of_the_campaign)]
        if any(parameter.location == "query" for parameter in operation.iter_parameters()):
            whole += [(GenerationMode.NEGATIVE, {}), (GenerationMode.NEGATIVE, of_the_campaign)]
        for mode, stated in whole:
            ask(operation, operation.as_strategy(mode, **stated))


def ask(operation, cases):
    """Whether a file is a recording, or a name that of a body area, no description can say: 4xx is an answer, too."""
    from schemathesis.specs.openapi.checks import positive_data_acceptance

    @settings(max_examples=max(1, EXAMPLES // SLOW.get(operation.path, 1)), deadline=None, database=None)
    @given(case=cases)
    def asked(case):
        case.call_and_validate(timeout=PATIENCE, headers=bearer(TOKEN), excluded_checks=[positive_data_acceptance])

    asked()
