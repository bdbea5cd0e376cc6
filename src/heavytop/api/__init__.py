"""What ``import heavytop`` offers: thin functions that check what they are given and join the other rooms."""
