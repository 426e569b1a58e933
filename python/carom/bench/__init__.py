"""How fast Carom is here: what is measured (`cases`), measuring it (`measuring`), telling it (`results`)."""
