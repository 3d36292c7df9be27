"""Registrations whose causes of failure are measured by counterfactuals."""
