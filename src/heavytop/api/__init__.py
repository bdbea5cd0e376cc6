"""The functions of ``import heavytop``: thin ones that check what they are given and join the other rooms."""
