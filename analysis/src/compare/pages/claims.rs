//! The section on the paper's claims.

use report::{Cell, Page, Table, Verdict};

use crate::compare::claims::Claim;

/// Every claim with its verdict, and where it holds.
pub fn claims_section(page: &mut Page, claims: &[Claim]) {
    page.section(2, "The paper's claims");
    page.paragraph(
        "Every claim is judged in every cell that it speaks of: both readings of the noise, both gimbal orders, headings from 0 to 180 deg every 15 deg, or every voyage. \
         It holds where it holds in all cells, in part where it holds in some. The criteria were fixed before the runs, and nothing is tuned.",
    );
    let mut table = Table::new(
        "What the paper says, and what was measured.",
        ["claim", "verdict", "cells", "criterion"],
    );
    for claim in claims {
        let holding = claim.cells.iter().filter(|c| c.holds).count();
        let verdict = match claim.verdict {
            "holds" => Verdict::Good,
            "does not hold" => Verdict::Bad,
            _ => Verdict::Warn,
        };
        table = table.row([
            Cell::text(&claim.text),
            Cell::verdict(verdict, claim.verdict),
            Cell::number(format!("{holding} of {}", claim.cells.len())),
            Cell::text(&claim.criterion),
        ]);
    }
    page.table(table);
    page.section(3, "Where, and by how much");
    for claim in claims {
        let mut table = Table::new(
            format!(
                "{}: {}. Measured: {}.",
                claim.text, claim.verdict, claim.criterion
            ),
            [
                "noise".to_owned(),
                "setting".to_owned(),
                format!(
                    "at heading {:.0} ({})",
                    claim.cells[0].heading_deg, claim.unit
                ),
                "over all headings".to_owned(),
                "holds".to_owned(),
            ],
        );
        for f in &claim.findings {
            let verdict = match (f.everywhere, f.nowhere) {
                (true, _) => Verdict::Good,
                (_, true) => Verdict::Bad,
                _ => Verdict::Warn,
            };
            table = table.row([
                Cell::text(f.reading),
                Cell::text(&f.setting),
                Cell::number(&f.first),
                Cell::number(&f.range),
                Cell::verdict(verdict, &f.holds),
            ]);
        }
        page.table(table);
    }
}
