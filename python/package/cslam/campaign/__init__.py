"""The shards of ``cslam campaign`` and ``cslam dataset`` on a Dask cluster: ``python -m cslam.campaign --help``.

Nothing else of the package needs Dask; it is the extra ``campaign``.
"""
