"""How an explanation is looked at: a page of its own, with both clouds in 3-D."""
