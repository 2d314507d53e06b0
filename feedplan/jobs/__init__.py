"""Jobs: programs that are planned away from who asks for them, in processes here or on a cluster.

    batch, service ──► place: processes | cluster ──► work ──► planning, files
                                 (process)  (cluster_task)

`order` is what is to be planned and `outcome` what became of it, as plain values that go over any line.
`work` plans one order, wherever it is. `place` says what a place for jobs does: `processes` has processes of
this computer, `cluster` the workers of a Dask cluster. `identity` tells whether two feedplans are the same,
`address` which clusters may be spoken to. All places give the same files, bit for bit but for the computing
times in them.
"""
