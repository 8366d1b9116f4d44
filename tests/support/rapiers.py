"""Rapier drives that are hard to certify."""

ROOM = {
    "bounds.l4": {"min": "11.16 mm", "max": "12.93 mm"},
    "bounds.l5": {"min": "473.4 mm", "max": "534.3 mm"},
    "bounds.l6": {"min": "168 mm", "max": "203.1 mm"},
    "bounds.l3p": {"min": "169.2 mm", "max": "197.5 mm"},
    "bounds.alpha": {"min": "28.18 deg", "max": "32.78 deg"},
    "bounds.C0x": {"min": "444.8 mm", "max": "480.7 mm"},
    "bounds.C0y": {"min": "211.1 mm", "max": "248 mm"},
    "bounds.phi40": {"min": "150.8 deg", "max": "175.3 deg"},
    "operation.stroke": "925 mm",
    "operation.s_dwell": "5.9 mm",
    "limits.mu_min.min": "50 deg",
    "operation.dwell_after": "48.841106 deg",
    "operation.dwell_before": "48.841106 deg",
}
"""A third of a degree less than these bounds can dwell: what is left free is to turn C0, B2 and crank about B0."""
