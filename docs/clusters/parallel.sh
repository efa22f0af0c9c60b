#!/bin/sh
# A run in parts under GNU parallel, on this machine or on others that see the same folder:
#   sh parallel.sh EXPERIMENT.json DIR PARTS [options of parallel, e.g. --sshlogin node1,node2]
# Killed, give it again: parts go on where they stopped.
set -eu
experiment=$1 dir=$2 parts=$3
shift 3
[ -f "$dir/cluster.json" ] || loopbench submit "$experiment" --tasks "$parts" --out "$dir" --no-queue --no-timing
# -q: parallel quotes each word, so that paths may hold spaces
seq "$parts" | parallel "$@" --will-cite -q sh -c 'sh "$1/part.sh" "$2" >>"$1/logs/$2.log" 2>&1' part "$(realpath "$dir")" {}
loopbench collect "$dir"
