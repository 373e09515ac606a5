source /work/env.sh; cd /tmp/h36; export PYTHONPATH=/work/wt/h36
while pgrep -f "first 1700" >/dev/null; do sleep 2; done
python /work/wt/h36/test/bench/health/run.py --causes --held --count 33 --out /tmp/h36/f1700.jsonl --first  1700
