#!/usr/bin/env bash
# Loads one recording, exported beside this file by `cie export --to clickhouse`, into ClickHouse:
#   ./load.sh [--cluster NAME] [--database NAME] [OPTIONS OF clickhouse-client]
# Without --cluster everything goes to one server. With it (a cluster of the server's configuration,
# every shard one replica) the recording goes to one of the shards, and its contents to all of them.
# What is loaded already is not loaded twice; what was interrupted is begun anew.
# Needs bash, clickhouse-client, flock. Exit codes: 0 loaded, 1 not loaded, 2 wrong usage.
set -euo pipefail
trap '[ $? -le 2 ] || exit 1' EXIT
cd "$(dirname "${BASH_SOURCE[0]}")"

recording='{{recording}}'
day='{{day}}'
# The tables of the recording and how many rows each has.
tables='
{{tables}}
'

fail() { printf 'load.sh: %s\n' "$1" >&2; exit "${2:-1}"; }

cluster=
database=cie
host=localhost
port=9000
options=()
while [ $# -gt 0 ]; do
  case $1 in
    --help) sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --cluster=* | --database=* | --host=* | --port=*) set -- "${1%%=*}" "${1#*=}" "${@:2}" ;;
    --cluster | --database | --host | --port)
      [ $# -ge 2 ] || fail "$1 needs a value" 2
      printf -v "${1#--}" %s "$2"
      shift 2
      ;;
    *) options+=("$1"); shift ;;
  esac
done
for name in "$database" "${cluster:-none}"; do
  [[ $name =~ ^[A-Za-z_][A-Za-z0-9_]*$ ]] || fail "\"$name\" is no name for a database or cluster" 2
done
command -v clickhouse-client >/dev/null || fail "clickhouse-client is missing"

# Two loaders of one directory take turns.
exec 9<"${BASH_SOURCE[0]##*/}"
flock 9

# ask SERVER QUERY: SERVER is HOST PORT, with a space between. Standard input is data.
ask() {
  clickhouse-client --host "${1% *}" --port "${1##* }" "${options[@]}" \
    --allow_experimental_low_cardinality_type=1 --database "${in_database:-$database}" --multiquery --query "$2"
}
tell() { ask "$@" </dev/null; }

# Makes what is missing. The names have no character that SQL or the shell could mistake.
prepare() {
  local readable
  if [ -z "$cluster" ]; then
    readable=$(cat single.sql)
  else
    readable=$(sed "s/{cluster}/$cluster/g; s/{database}/$database/g" cluster.sql)
  fi
  in_database=default tell "$1" "CREATE DATABASE IF NOT EXISTS $database; USE $database; $(cat schema.sql) $readable"
}

# counts SERVER PREFIX SUFFIX TABLE...: a line for each of these tables that has rows of the recording.
counts() {
  local server=$1 prefix=$2 suffix=$3 query='' table
  shift 3
  for table; do
    query+="${query:+ UNION ALL }SELECT '$table' AS name, count() AS rows FROM $prefix$table$suffix WHERE recording = '$recording'"
  done
  tell "$server" "SELECT name, rows FROM ($query) WHERE rows > 0 ORDER BY name FORMAT TabSeparatedRaw"
}

# remove_rows SERVER TABLE...: what an interrupted loader left.
remove_rows() {
  local server=$1 table tries left
  shift
  for ((tries = 0; tries < 600; ++tries)); do
    left=$(counts "$server" "" _shard "$@")
    [ -n "$left" ] || return 0
    if [ "$tries" -eq 0 ]; then
      while read -r table _; do
        tell "$server" "ALTER TABLE ${table}_shard DELETE WHERE recording = '$recording'"
      done <<<"$left"
    fi
    sleep 0.1
  done
  fail "rows that an interrupted loader left at $server cannot be removed: $left"
}

# load SERVER TABLE...: rows appear all at once, when they are complete; questions see no part of a table.
load() {
  local server=$1 staged="load_${recording}_" table made='' moved='' dropped=''
  shift
  for table; do
    dropped+="DROP TABLE IF EXISTS $staged$table; "
    moved+="ALTER TABLE ${table}_shard ATTACH PARTITION '$day' FROM $staged$table; "
    made+=$(sed -n "s/^CREATE TABLE IF NOT EXISTS ${table}_shard/CREATE TABLE $staged$table/; /^CREATE TABLE $staged/,/;/p" schema.sql)
  done
  tell "$server" "$dropped $made"
  for table; do
    ask "$server" "INSERT INTO $staged$table FORMAT RowBinary" <"data/$table.rowbinary"
  done
  [ "$(counts "$server" "$staged" '' "$@")" = "$(expected "$@")" ] || fail "the data are not those that were exported: export the recording anew"
  tell "$server" "$moved $dropped"
}
# expected TABLE...: as counts has it.
expected() {
  local table
  for table; do printf '%s\t%s\n' "$table" "${rows[$table]}"; done | LC_ALL=C sort
}

declare -A rows=()
all=()
filled=()
while read -r table count; do
  [ -n "$table" ] || continue
  rows[$table]=$count
  [ "$table" != contents ] || continue
  all+=("$table")
  [ "$count" -eq 0 ] || filled+=("$table")
done <<<"$tables"

servers=("$host $port")
if [ -n "$cluster" ]; then
  list=$(in_database=default tell "$host $port" "SELECT concat(host_name, ' ', toString(port)) FROM system.clusters
    WHERE cluster = '$cluster' AND replica_num = 1 ORDER BY shard_num")
  [ -n "$list" ] || fail "the server at $host:$port knows no cluster $cluster"
  mapfile -t servers <<<"$list"
fi
for server in "${servers[@]}"; do
  prepare "$server"
done

# By all servers: one that is not there is an error, and ends the script.
known=$(counts "${servers[0]}" '' '' contents)
if [ -n "$known" ]; then
  printf 'recording %s is loaded already\n' "$recording"
else
  for server in "${servers[@]}"; do
    remove_rows "$server" "${all[@]}"
  done
  home=${servers[$((16#${recording:0:15} % ${#servers[@]}))]}
  load "$home" "${filled[@]}"
  printf 'recording %s: loaded into %s\n' "$recording" "${home/ /:}"
fi
# From now on it is expected to be there, whichever server is asked. So few rows are inserted all or none.
for server in "${servers[@]}"; do
  known=$(counts "$server" '' _shard contents)
  [ -z "$known" ] || continue
  ask "$server" "INSERT INTO contents_shard FORMAT RowBinary" <data/contents.rowbinary
done
