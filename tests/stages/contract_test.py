#!/usr/bin/env python3
"""What contract.py takes for a broken promise, and what not; needs no protoc."""

import unittest

import contract


def file(package="vantage.v1", body=""):
    return f'file {{\n  package: "{package}"\n{body}\n}}\n'


def message(body):
    return f'  message_type {{\n    name: "M"\n{body}\n  }}\n'


def field(number=1, kind="TYPE_DOUBLE", name="a_m"):
    return (f'    field {{\n      name: "{name}"\n      number: {number}\n'
            f'      label: LABEL_OPTIONAL\n      type: {kind}\n    }}\n')


def reserved(start, end):
    return f"    reserved_range {{\n      start: {start}\n      end: {end}\n    }}\n"


def enum(body):
    value = '    value {\n      name: "E_UNSPECIFIED"\n      number: 0\n    }\n'
    return f'  enum_type {{\n    name: "E"\n{value}{body}\n  }}\n'


def lines(before, after):
    return contract.broken(contract.promises(file(body=before)),
                           contract.promises(file(body=after)))


class Fields(unittest.TestCase):
    def test_what_is_the_same_is_kept(self):
        self.assertEqual(lines(message(field()), message(field())), [])

    def test_one_more_is_no_break(self):
        self.assertEqual(lines(message(field()), message(field() + field(2, name="b_m"))), [])

    def test_another_type_is_a_break(self):
        self.assertEqual(
            lines(message(field()), message(field(kind="TYPE_FLOAT"))),
            ["vantage.v1.M, field 1: was LABEL_OPTIONAL TYPE_DOUBLE a_m, "
             "is LABEL_OPTIONAL TYPE_FLOAT a_m"])

    def test_one_that_is_gone_is_a_break(self):
        self.assertEqual(lines(message(field()), message("")),
                         ["vantage.v1.M, field 1: was LABEL_OPTIONAL TYPE_DOUBLE a_m, is gone"])

    def test_other_packages_promise_nothing(self):
        other = contract.promises(file("google.rpc", message(field())))
        self.assertEqual((other.said, other.reserved), ({}, {}))


class Reserved(unittest.TestCase):
    def test_numbers_of_a_message_that_are_released_are_a_break(self):
        self.assertEqual(lines(message(reserved(4, 7)), message("")),
                         ["vantage.v1.M, from 4 to 6: reserved no more"])

    def test_a_span_that_grew_is_no_break(self):
        self.assertEqual(lines(message(reserved(4, 7)), message(reserved(3, 9))), [])

    def test_spans_that_grew_together_are_no_break(self):
        self.assertEqual(
            lines(message(reserved(4, 5) + reserved(6, 7)), message(reserved(4, 7))), [])

    def test_a_span_that_was_split_is_no_break(self):
        self.assertEqual(
            lines(message(reserved(4, 7)), message(reserved(4, 6) + reserved(6, 7))), [])

    def test_the_middle_of_a_span_that_is_released_is_named(self):
        self.assertEqual(
            lines(message(reserved(4, 9)), message(reserved(4, 6) + reserved(7, 9))),
            ["vantage.v1.M, from 6 to 6: reserved no more"])

    def test_numbers_of_an_enum_that_are_released_are_a_break(self):
        # An enum's span ends with its last number, a message's behind it.
        self.assertEqual(lines(enum(reserved(4, 6)), enum(reserved(4, 5))),
                         ["enum vantage.v1.E, from 6 to 6: reserved no more"])

    def test_a_name_of_an_enum_that_is_released_is_a_break(self):
        self.assertEqual(lines(enum('    reserved_name: "E_OLD"\n'), enum("")),
                         ["enum vantage.v1.E, name E_OLD: was reserved, is gone"])


class Values(unittest.TestCase):
    def test_another_name_is_a_break(self):
        value = '    value {{\n      name: "{}"\n      number: 1\n    }}\n'
        self.assertEqual(lines(enum(value.format("E_A")), enum(value.format("E_B"))),
                         ["enum vantage.v1.E, value 1: was E_A, is E_B"])


if __name__ == "__main__":
    unittest.main()
