"""How well explainers name the measured causes of failed registrations (Table IX)."""
