"""Maximum-likelihood refinement: the reprojection error, its minimisation, and small linear systems in batches."""
