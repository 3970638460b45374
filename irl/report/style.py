"""The style sheet of the page: one column, its own ink in light and dark, rows that stack on a phone."""

CSS = """
:root { color-scheme: light dark; --ink: #1d2126; --soft: #5c6570; --paper: #ffffff; --card: #f6f7f9;
  --rule: #dfe3e8; --link: #2468a2; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e8eaed; --soft: #a3abb5; --paper: #14171b; --card: #1c2026; --rule: #343a42;
    --link: #7db4e6; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); -webkit-text-size-adjust: 100%;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
main { max-width: 920px; margin: 0 auto; padding: 28px 20px 56px; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 6px; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; line-height: 1.3; margin: 0 0 4px; }
p { margin: 0 0 10px; }
.lead { font-size: 1.08rem; margin: 10px 0 16px; max-width: 68ch; }
.soft, .reading { color: var(--soft); }
.reading { max-width: 76ch; font-size: .94rem; }
.kind { color: var(--soft); margin: 0; }
section { margin-top: 40px; }
.absent { background: var(--card); border-left: 3px solid var(--rule); padding: 10px 14px;
  margin: 8px 0 0; overflow-wrap: anywhere; }
dl.facts { display: grid; grid-template-columns: max-content 1fr; gap: 2px 18px; margin: 0;
  font-size: .94rem; }
dl.facts dt { color: var(--soft); }
dl.facts dd { margin: 0; overflow-wrap: anywhere; min-width: 0; }
table { border-collapse: collapse; width: 100%; font-size: .94rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; vertical-align: top; padding: 7px 14px 7px 0;
  border-bottom: 1px solid var(--rule); }
thead th { color: var(--soft); font-weight: 500; }
tbody th { font-weight: 500; }
td { overflow-wrap: anywhere; }
.keys tbody th { width: 27%; }
.keys .value { width: 21%; font-weight: 600; white-space: nowrap; }
.keys .value.unknown { font-weight: 400; color: var(--soft); }
.keys .says { color: var(--soft); }
.strata { margin-top: 22px; }
.strata td, .strata thead th:not(:first-child) { text-align: right; }
.strata td, .strata tbody th { white-space: nowrap; }
.dot { display: inline-block; width: .7em; height: .7em; border-radius: 50%; margin-right: .5em; }
details { margin-top: 14px; }
summary { cursor: pointer; color: var(--link); }
details dl.facts { margin-top: 8px; }
code { font: .9em ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
footer { margin-top: 44px; border-top: 1px solid var(--rule); padding-top: 12px; font-size: .88rem;
  color: var(--soft); }
.js-plotly-plot text { fill: var(--ink) !important; }
.js-plotly-plot g[class$="tick"] text { fill: var(--soft) !important; }
.js-plotly-plot .hoverlayer text { fill: #1a1a1a !important; }
@media (max-width: 640px) {
  main { padding: 20px 14px 40px; }
  .keys thead { display: none; }
  .keys tr, .keys th, .keys td { display: block; width: auto !important; border: 0; padding: 0; }
  .keys tr { border-bottom: 1px solid var(--rule); padding: 9px 0; }
  .keys tbody th { color: var(--soft); font-size: .88rem; }
  .keys .value { white-space: normal; font-size: 1.08rem; }
  dl.facts { grid-template-columns: 1fr; gap: 0; }
  dl.facts dd { margin-bottom: 6px; }
  .strata { font-size: .86rem; }
  .strata th, .strata td { padding-right: 8px; }
  .strata td:last-child { padding-right: 0; }
}
@media print { section { break-inside: avoid; } }
"""
