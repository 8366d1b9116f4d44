"""How an optimum moves with the scene's numbers: from the KKT system of its active rows."""
