"""How a re-enactment goes, and what it would say if it knew more (Table IX by what is known)."""
