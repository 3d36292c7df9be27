"""How far promises about causes hold: sets of states and an alarm, on families of shapes that nothing was set on."""
