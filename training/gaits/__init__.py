"""Search for parameters that the paper leaves open: ``python -m training.gaits.search``.

CMA-ES (Hansen 2016, arXiv:1604.00772) varies the parameters of a scene; the card of its gait, which
``python -m training.gaits`` prints, is the score. `limits` has the lines of a card and what the
paper and a human require, `measures` computes those that `skate_env.gait` does not have,
`robustness` counts the perturbed starts that survive. `variables` says what varies, `score` what is
best, `evolution` how the best is found, and `scene_file` writes it. `starts` has the scenes from
which the presets were found. README.md beside this file describes the search.
"""
