#!/usr/bin/env python3
"""The rules of the house as checks: each prints `file:line: [rule] what, and what to do` and the run fails if
any did.

lint.py [--root DIR] [RULE...]    checks all rules, or those named; --list names them
Only Python's standard library is used, so the tests need nothing else.
"""
import argparse
import pathlib
import sys

import rules_code
import rules_form
import rules_header
import rules_pages
import rules_tree
from tree import Tree

RULES = {**rules_tree.RULES, **rules_form.RULES, **rules_code.RULES, **rules_header.RULES,
         **rules_pages.RULES}


def check(root, names=None):
    """Findings of the rules on the tree below root, as printable lines."""
    tree = Tree(root)
    lines = []
    for name in names or RULES:
        lines += [f"{path}:{line}: [{name}] {message}" for path, line, message in RULES[name](tree)]
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", default=pathlib.Path(__file__).resolve().parents[2])
    parser.add_argument("--list", action="store_true")
    parser.add_argument("rules", nargs="*", choices=[*RULES, []], metavar="RULE")
    options = parser.parse_args()
    if options.list:
        print("\n".join(RULES))
        return 0
    findings = check(options.root, options.rules)
    print("\n".join(findings) if findings else "clean")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
