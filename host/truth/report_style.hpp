// How a report looks, on a screen and on paper.
#pragma once

namespace parian {

inline constexpr const char* report_style = R"css(
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.2rem 1.5rem 4rem; max-width: 1040px; background: #fff; color: #1a1a1a;
  font: 16px/1.5 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.6rem 0 .5rem; }
p { margin: .5rem 0; max-width: 46rem; }
.sub { color: #555; margin-bottom: 1.2rem; max-width: none; }
.lead { font-size: 1.1rem; border-left: 4px solid #0072b2; padding: .1rem 0 .1rem 1rem; margin: 1.2rem 0; }
.lead p { max-width: none; }
.warning { border-left: 4px solid #d55e00; padding: .1rem 0 .1rem 1rem; }
figure { margin: 1rem 0 1.6rem; break-inside: avoid; }
figure > svg { display: block; max-width: 100%; height: auto; }
figcaption, .note { color: #444; font-size: .9rem; max-width: 46rem; }
h3 { font-size: 1rem; margin: 1.4rem 0 .2rem; break-after: avoid; }
h2, h2 + p { break-after: avoid; }
.scroll { break-inside: avoid; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .7rem 0 .6rem; font-variant-numeric: tabular-nums; font-size: .88rem;
  break-inside: avoid; }
th, td { padding: .32rem .45rem; text-align: right; vertical-align: top; border-bottom: 1px solid #ddd; }
thead th { font-weight: 600; border-bottom: 1.5px solid #555; vertical-align: bottom; }
thead tr.group th { border-bottom: 1px solid #bbb; text-align: center; }
th:first-child, td:first-child { text-align: left; padding-left: 0; font-weight: 400; white-space: normal; }
td.first, th.first { border-left: 1px solid #ccc; }
td small { display: block; color: #666; font-size: .8em; line-height: 1.2; white-space: nowrap; }
td + td { white-space: nowrap; }
tr.ours td { background: #eef6fb; }
tr.ours td:first-child { font-weight: 600; }
.far { font-style: italic; color: #555; }
.pictures { display: flex; flex-wrap: nowrap; gap: .5rem; align-items: flex-start; }
.pictures div { flex: 1 1 0; min-width: 0; font-size: .78rem; line-height: 1.3; color: #333; }
.pictures img { display: block; width: 100%; height: auto; image-rendering: pixelated; background: #262626;
  margin-bottom: .25rem; print-color-adjust: exact; -webkit-print-color-adjust: exact; }
.pictures .error img { background: #fff; outline: 1px solid #ddd; outline-offset: -1px; }
.nobr { white-space: nowrap; }
.scale { display: inline-block; width: 11rem; height: .8em; vertical-align: -1px; margin: 0 .4rem;
  background: linear-gradient(90deg, #00f, #fff, #f00); border: 1px solid #aaa;
  print-color-adjust: exact; -webkit-print-color-adjust: exact; }
pre { background: #f5f5f5; padding: .7rem .9rem; font-size: .82rem; line-height: 1.45; white-space: pre-wrap;
  overflow-wrap: anywhere; font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; }
code { font-family: ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; font-size: .9em; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; margin: .6rem 0; font-size: .92rem; }
dt { color: #555; }
dd { margin: 0; overflow-wrap: anywhere; }
@page { size: A4; margin: 14mm 13mm; }
@media print {
  body { padding: 0; max-width: none; font-size: 10.5pt; }
  h2 { margin-top: 1.4rem; }
  table { font-size: 8.6pt; }
  th, td { padding: .22rem .5rem; }
  pre { font-size: 7pt; }
  .scroll { overflow: visible; }
  tr.ours td { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
)css";

}  // namespace parian
