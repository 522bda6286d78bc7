"""Search for parameters that the paper leaves open: ``python -m training.gaits.search``.

CMA-ES (Hansen 2016, arXiv:1604.00772) varies the parameters of a scene; the card of its gait
(`skate_env.gait`) is the score. `variables` says what varies, `score` what is best, `evolution`
how the best is found, and `scene_file` writes it. `starts` has the scenes from which the presets
were found. README.md beside this file describes the search.
"""
