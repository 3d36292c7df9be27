"""How a user says in which unit lengths are, for messages: in a config, on the command line, in Python."""

IN_CONFIG, AS_OPTION, AS_ARGUMENT = "set unit: {}", "give --unit {}", "pass unit='{}'"
