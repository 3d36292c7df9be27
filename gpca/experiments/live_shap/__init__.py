"""shap's ``KernelExplainer`` on a function that registers, beside the values from a table of its outcomes."""
