"""What a run says of where it was made: asked once, since a file of results is written hundreds of times."""
from importlib import metadata

from pysph_boiling.runs import provenance


def test_versions_are_asked_once(monkeypatch):
    asked, ask = [], metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: (asked.append(name), ask(name))[1])
    provenance.versions.cache_clear()
    records = [provenance.origin() for _ in range(3)]
    assert sorted(asked) == ["compyle", "cython", "numpy", "pysph", "pysph_boiling"]
    assert all(record["versions"] == records[0]["versions"] for record in records)
    assert set(records[0]["versions"]) == {"python", *asked} and records[0]["processor"]


def test_package_that_is_not_installed_is_left_out(monkeypatch):
    def missing(name):
        raise metadata.PackageNotFoundError(name)

    provenance.versions.cache_clear()
    monkeypatch.setattr(metadata, "version", missing)
    assert set(provenance.versions()) == {"python"}
    provenance.versions.cache_clear()
