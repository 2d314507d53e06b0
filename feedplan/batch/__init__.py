"""Many programs, or a sweep of machines, tolerances and methods: a folder and a row of a table for each plan.

    sweep ──► run ──► journal ──► summary
             (jobs.place, packing)

`sweep` has what is to be planned and the names of the folders, `run` plans it in a place for jobs, `journal`
keeps a row of each plan that is done, so that a batch that was stopped goes on where it was, `summary`
writes batch.csv and batch.json.
"""
