#!/usr/bin/env python3
"""compare.py RESULT EXPECTED [TOLERANCE]: do two CSV files hold the same columns and, nearly, the same numbers?

Units behind a column's name are not compared. The first difference is printed.
"""
import csv
import sys


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return [name.split(" (")[0] for name in rows[0]], [[float(x) for x in row] for row in rows[1:]]


def main(result_path, expected_path, tolerance=1e-9):
    (names, result), (expected_names, expected) = read(result_path), read(expected_path)
    if names != expected_names:
        return f"columns are {names}, expected {expected_names}"
    if len(result) != len(expected):
        return f"{len(result)} samples, expected {len(expected)}"
    for row, expected_row in zip(result, expected):
        for name, x, y in zip(names, row, expected_row):
            if not abs(x - y) <= float(tolerance):
                return f"{name} at {row[0]} s is {x}, expected {y}"
    return None


problem = main(*sys.argv[1:])
if problem:
    sys.exit(f"{sys.argv[1]}: {problem}")
