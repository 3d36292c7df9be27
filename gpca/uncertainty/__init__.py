"""Monte-Carlo ICP under the conditions that SHAP and sensitivity analysis ask for, and estimators of covariance."""
