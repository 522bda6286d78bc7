"""Start a Ray cluster of two nodes, print its address and nodes, stop it when the input ends.

A program of its own because Ray reads its environment variables on its first import, and another
test may have imported it before.
"""

import json
import sys

from ray.cluster_utils import Cluster


def main() -> None:
    cluster = Cluster()
    try:
        for _ in range(2):
            cluster.add_node(num_cpus=1, object_store_memory=100 * 2**20)
        nodes = [node.node_id for node in cluster.list_all_nodes()]
        print(json.dumps({"address": cluster.address, "nodes": nodes}), flush=True)
        sys.stdin.read()
    finally:
        cluster.shutdown()


if __name__ == "__main__":
    main()
