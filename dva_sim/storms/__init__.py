"""Fault storms: hours in which much goes wrong, from a seed, and what the rules say of them.

A storm is drawn from its seed alone, runs in virtual time, and is judged by checkers that ask no
agent anything. A storm that breaks a rule is cut down to the faults that matter.
"""
