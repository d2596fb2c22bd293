"""Judges JSON documents by JSON schemas; prints what is wrong with each, by document."""

import json
import sys

from jsonschema import Draft202012Validator

found = {}
for pair in sys.argv[1:]:
    schema_path, document_path = pair.split("=")
    with open(schema_path) as file:
        schema = json.load(file)
    Draft202012Validator.check_schema(schema)
    with open(document_path) as file:
        document = json.load(file)
    errors = Draft202012Validator(schema).iter_errors(document)
    found[document_path] = [f"{error.json_path}: {error.message[:200]}" for error in errors]
print(json.dumps(found))
