"""How fast it runs here: ``single`` measures one task and its parts, ``vector`` many at once."""
