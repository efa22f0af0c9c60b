"""Verdicts of a JSON Schema on files: one line per file, "valid", "invalid" or "no JSON".

usage: schema_verdicts.py SCHEMA FILE...
Schemas refer to each other by file name, within their folder.
"""
import json
import pathlib
import sys

import jsonschema


def refuse_constant(name):
    raise ValueError(f"{name} is no JSON")


def refuse_twice(pairs):
    members = dict(pairs)
    if len(members) < len(pairs):
        raise ValueError("a key twice")
    return members


def load(path):
    with open(path, encoding="utf-8") as stream:
        return json.load(stream, parse_constant=refuse_constant, object_pairs_hook=refuse_twice)


def verdict(validator, path):
    try:
        document = load(path)
    except (ValueError, RecursionError):
        return "no JSON"
    return "valid" if validator.is_valid(document) else "invalid"


schema_path = pathlib.Path(sys.argv[1]).resolve()
schema = load(schema_path)
jsonschema.Draft7Validator.check_schema(schema)
store = {path.as_uri(): load(path) for path in schema_path.parent.glob("*.json")}
resolver = jsonschema.RefResolver(schema_path.as_uri(), schema, store=store)
validator = jsonschema.Draft7Validator(schema, resolver=resolver)
for name in sys.argv[2:]:
    print(verdict(validator, name))
