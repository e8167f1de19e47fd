# SPDX-License-Identifier: GPL-3.0-or-later
"""The stubs name what there is, with the same arguments and defaults."""

import ast
import importlib.metadata
import inspect
import os
import unittest

import subvol

PACKAGE = os.path.dirname(subvol.__file__)


def stub_of(name):
    with open(os.path.join(PACKAGE, name)) as file:
        return ast.parse(file.read())


def public(names):
    return {name for name in names if not name.startswith("_")}


def arguments_of(function):
    """(name, kind, default as text) of a function in a stub, without self."""
    a = function.args
    places = a.posonlyargs + a.args
    defaults = [None] * (len(places) - len(a.defaults)) + a.defaults
    found = [(arg.arg, "place", default) for arg, default in zip(places, defaults)]
    found += [(arg.arg, "keyword", default) for arg, default in zip(a.kwonlyargs, a.kw_defaults)]
    return [(name, kind, ast.literal_eval(default) if default else inspect.Parameter.empty)
            for name, kind, default in found if name != "self"]


def parameters_of(function):
    kinds = {inspect.Parameter.KEYWORD_ONLY: "keyword"}
    return [(p.name, kinds.get(p.kind, "place"), p.default) for p in inspect.signature(function).parameters.values()
            if p.name != "self"]


class Stubs(unittest.TestCase):
    def compare(self, module, stub):
        functions = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}
        classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
        values = {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign)}
        self.assertEqual(public(functions) | public(classes) | public(values) | public(self.modules(stub)),
                         public(module.__all__))
        for name, function in functions.items():
            self.assertEqual(arguments_of(function), parameters_of(getattr(module, name)), name)
        for name, stubbed in classes.items():
            self.compare_class(getattr(module, name), stubbed)

    def modules(self, stub):
        return {alias.asname for node in stub.body if isinstance(node, ast.ImportFrom) and node.module is None
                for alias in node.names if alias.asname}

    def compare_class(self, found, stubbed):
        members = {node.name: node for node in stubbed.body if isinstance(node, ast.FunctionDef)}
        self.assertEqual([base.id for base in stubbed.bases if isinstance(base, ast.Name)] or ["object"],
                         [base.__name__.replace("pybind11_", "") for base in found.__bases__], stubbed.name)
        if not issubclass(found, Exception):
            self.assertEqual(public(members), public(vars(found)), stubbed.name)
        for name, member in members.items():
            if any(isinstance(d, ast.Name) and d.id == "property" for d in member.decorator_list):
                self.assertIsInstance(vars(found)[name], property, name)
                self.assertTrue(vars(found)[name].__doc__, name)
            elif name == "__init__":
                self.assertEqual(arguments_of(member), parameters_of(found), stubbed.name)
            else:
                self.assertEqual(arguments_of(member), parameters_of(getattr(found, name)), f"{stubbed.name}.{name}")

    def test_the_module(self):
        self.compare(subvol, stub_of("__init__.pyi"))

    def test_templates(self):
        self.compare(subvol.template, stub_of("template.pyi"))

    def test_everything_has_help(self):
        for module in (subvol, subvol.template):
            for name in module.__all__:
                self.assertTrue(getattr(module, name).__doc__, name)

    def test_tools_know_the_package(self):
        package = importlib.metadata.distribution("subvol")
        self.assertEqual(package.version, subvol.__version__)
        self.assertTrue(package.files)
        for file in package.files:
            self.assertTrue(os.path.exists(file.locate()), file)

    def test_it_says_that_it_has_types(self):
        self.assertTrue(os.path.exists(os.path.join(PACKAGE, "py.typed")))


if __name__ == "__main__":
    unittest.main()
