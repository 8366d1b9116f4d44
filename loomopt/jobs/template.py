"""The commented scenes that `loomopt new` writes."""

BEATUP_TEMPLATE = """\
"""
