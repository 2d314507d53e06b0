"""Plans many programs, or a sweep of machines, tolerances and methods: a folder and a table row for each
plan.

    sweep ──► run ──► journal ──► summary
              (jobs.executor, packing)

`sweep` lists the plans and names their folders, `run` has them made by an executor, `journal` keeps the rows
of finished plans, so that a stopped batch can continue, `summary` writes batch.csv and batch.json.
"""
