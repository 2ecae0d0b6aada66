import sys, json, pathlib, shutil
sys.path.insert(0, '.')
from oracle import difference, scenario
from recompute import recompute
for ex in ('isolated','single_threaded','multi_threaded'):
  for seed in range(6):
    s=scenario.Scenario('plain',seed,cpus=(1,2,4)[seed%3])
    s.standard(ex); s.run()
    d=pathlib.Path('/tmp/orc')/f'{ex}{seed}'; shutil.rmtree(d,ignore_errors=True); s.write(d)
    r=recompute([str(d/'trace')], str(d/'spec.yaml'))
    print(ex, seed, len(s.machine.user), len(s.machine.kernel), len(s.rows()))
    for l in difference.compare(json.load(open(d/'report.json')), r['report'])[:10]: print('  ',l)
    for l in difference.compare_text((d/'instances.csv').read_text(), r['instances'],'csv'): print('  ',l)
    for l in difference.compare_verdicts(json.load(open(d/'verify.json')), r['verify'])[:10]: print('  ',l)
